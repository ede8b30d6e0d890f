"""Live twin: a model of the specimen under the measured table motion, computed during every test."""
