"""The edges of recording: ports, boards, files that survive, and what the terminal shows.

`acquisition.protocol` says what bytes on the line mean; here they are fetched, placed in time
(`timeline`), kept (`archive`) and shown (`terminal`, `window`), and `session` runs it all. A bench
without hardware for the demo and the tests: `stand_in` imitates the logger, `cable` joins it to the
recorder, `workbench` lets its time pass.
"""
