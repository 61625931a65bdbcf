"""Problems whose numbers are known with an error."""
