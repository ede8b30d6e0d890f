"""The calls of the gRPC service, one file per subject: thin translations between messages and the driver."""
