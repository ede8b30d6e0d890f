"""A report as data, and its two forms: one HTML file without references to others, and PDF pages."""
