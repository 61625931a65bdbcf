"""Recorded states, and what was scored of them."""
