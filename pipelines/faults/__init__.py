"""What happens to a run: kills, full disks, garbled files, and bad input at random.

- ``bench``: folders, references that nothing happened to, and what was seen
- ``cases``: what may happen to a run: each case breaks something, asks again, compares
- ``fuzz``: bad input at random, and what a user would see
- ``fuzz_workers``: worker processes for command lines that may do anything
- ``victims``: runs to be killed, in forked processes
"""
