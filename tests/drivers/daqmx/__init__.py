"""The NI-DAQmx driver, against emulated devices that the real client speaks to."""
