"""What a stamp means: the constant between the stamps of two cameras, measured from what both of them filmed. Pure: images and stamps in, figures out."""
