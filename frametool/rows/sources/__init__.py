"""Sources of rows and records, read block by block: tables, texts of records, files of columns."""
