"""Files that are whole or not there: text, archives, results folders and their locks."""
