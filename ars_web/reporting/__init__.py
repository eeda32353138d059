"""Reports as pages of one file: HTML from templates, pictures and plots inside."""
