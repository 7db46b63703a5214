// Hair among hair, fragment stage of what CVs leave in the cells.
void main()
{
  cell_sums = lanes;
}
