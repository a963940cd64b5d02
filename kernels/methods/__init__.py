"""Integration methods as data, and step control."""
