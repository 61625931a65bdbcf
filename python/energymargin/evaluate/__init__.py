"""Questions and their answers, on workers."""
