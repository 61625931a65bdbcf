"""The paper's tables and figures, on our tasks and on the data that its authors published."""
