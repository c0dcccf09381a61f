"""Representations of a record where its physics is sparse, each level with its sampling uncertainty."""
