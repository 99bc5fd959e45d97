"""What a participant sees or is read, by language: the messages in English, the catalogues, the fonts they need."""
