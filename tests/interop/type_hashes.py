"""Prints the RIHS01 type hash of every message in protocol/msg as JSON."""

import json

from peer import types

store, names = types()
print(json.dumps({name: store.hash_rihs01(name) for name in names}))
