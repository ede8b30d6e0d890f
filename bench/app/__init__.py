"""The application: sessions, queue, reports, exports, command line, window, benchmark."""
