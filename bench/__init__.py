"""The application: engine, guard, control, analysis, record, report, command line."""
