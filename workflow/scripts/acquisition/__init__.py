"""The edges of recording: ports, boards, files that survive, and what the terminal shows.

`acquisition.protocol` says what bytes on the line mean; here they are fetched, placed in time
(`timeline`), kept (`archive`) and shown (`terminal`, `window`), and `session` runs it all.
"""
