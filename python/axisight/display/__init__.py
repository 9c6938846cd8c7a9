"""What is shown of results in notebooks, and of work in progress anywhere."""
