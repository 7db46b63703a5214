// Hair among hair: deposit of CVs into the cells, fragment stage.
void main()
{
  cell_sums = mass_motion;
}
