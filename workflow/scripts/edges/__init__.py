"""What the scripts share: files and settings in, files out."""
