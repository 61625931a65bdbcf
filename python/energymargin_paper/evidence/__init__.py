"""What is known of the scores beyond the paper: exact answers, other engines, uses."""
