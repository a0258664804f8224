"""The equations of the paper, on arrays."""
