"""The folder of a sweep: its manifest, shards and lock."""
