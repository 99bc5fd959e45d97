"""Which stimulus comes next: functions of a frozen rule and of the answers so far. They keep no state."""
