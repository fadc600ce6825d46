"""LLVM text from instruction lists, and its compilation in memory."""
