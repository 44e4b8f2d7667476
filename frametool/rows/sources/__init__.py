"""What rows and records come from: tables, texts of records, files of columns; read block by block."""
