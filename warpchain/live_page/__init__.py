"""The live page: a web page with sliders on which a chain walks, its server, and a page of walks that needs no Python.

The command `warpchain live` and the function `warpchain.live` start the server; nothing else imports this subpackage.
"""
