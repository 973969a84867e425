"""The same mechanism in other programs, for comparisons."""
