// Does nothing: but what draws before it have stored, can be read after it.

void main() {}
