"""Grasps from files, and how well each of them holds."""
