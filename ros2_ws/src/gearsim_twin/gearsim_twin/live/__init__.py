"""The live twin: a model beside a stream, window by window."""
