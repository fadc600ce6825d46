         : status == NOT_COMMANDED      ? "a measurement or a command is not finite\n"
