"""A stand-in for NI's gRPC device server with DAQ devices in it: the real nidaqmx client speaks with it."""
