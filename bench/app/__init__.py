"""The application: sessions, queue, reports, exports, command line, window and benchmark."""
