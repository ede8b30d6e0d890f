"""Reports as data, and their rendering as a self-contained HTML file or PDF pages."""
