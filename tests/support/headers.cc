// Empty: its target holds the headers that all tests share, precompiled.
