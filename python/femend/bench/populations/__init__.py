"""`femend population`: mean and scatter over nominally equal structures."""
