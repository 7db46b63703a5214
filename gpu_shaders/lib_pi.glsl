// The constant pi. Holds no resources.

const float PI = 3.14159265358979;
