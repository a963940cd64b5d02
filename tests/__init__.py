"""Tests of warpchain; a package, so that test modules can share cases by relative import."""
