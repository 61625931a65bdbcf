"""Pictures, pages and words of results."""
