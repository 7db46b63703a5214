// Does nothing, but after it, image stores of earlier draws can be read.

void main() {}
