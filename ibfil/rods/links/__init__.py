"""Links between rods: springs, hinges, and rods bound along their length."""
