"""Loop check of a bench: a test of the sensors and the shaker at low amplitude before an experiment."""
