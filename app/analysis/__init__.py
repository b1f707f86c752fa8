"""What experiments showed: tables, figures, pages. The only room that speaks matplotlib."""
