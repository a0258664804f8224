"""Import recordings from files of other programs into raw/; each format has one module."""
