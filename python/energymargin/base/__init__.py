"""What every floor needs: checks, errors, files that are replaced whole, words for people."""
