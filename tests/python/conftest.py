import signal

# In the background of a shell Ctrl-C is ignored, also in the processes that the tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)
