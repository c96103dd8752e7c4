"""The command line of zfcal: parse, load, call one function, write."""
