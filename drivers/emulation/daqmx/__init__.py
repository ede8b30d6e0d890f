"""An emulation of NI's gRPC device server with DAQ devices: the real nidaqmx client connects to it."""
