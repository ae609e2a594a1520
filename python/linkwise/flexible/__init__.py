"""What describes flexible links."""
