"""NI-DAQmx: the drive output, the analogue inputs and the enable line, on this PC or through a gRPC device server."""
