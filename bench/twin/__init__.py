"""The live twin: the model of the specimen runs beside every test, under the table's motion as it is measured."""
