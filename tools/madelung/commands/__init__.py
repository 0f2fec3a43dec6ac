"""The commands of ``madelung``, one module each: they parse, call the library, print."""
