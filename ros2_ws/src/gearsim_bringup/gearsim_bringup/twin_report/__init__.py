"""The verdict of the judge as one page."""
