"""The commands with their options, one module a family. Nothing heavy is imported before a command is called."""
