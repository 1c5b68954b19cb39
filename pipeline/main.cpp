// The program `cairn`; see program.h.
#include "pipeline/program.h"

int main(int argc, char** argv) { return cairn::pipeline::run_program(argc, argv); }
