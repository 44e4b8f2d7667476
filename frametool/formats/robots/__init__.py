"""Robot descriptions: links and joints, and what moves the joints; one file a form, one model for all of them."""
