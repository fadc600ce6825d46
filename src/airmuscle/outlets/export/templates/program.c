int main(int argc, char **argv)
{
  FILE *out = argc > 1 ? fopen(argv[1], "w") : stdout;
  int status;
  if (!out) {
    perror(argv[1]);
    return 1;
  }
  fputs(header, out);
  status = run(out);
  if (out != stdout && fclose(out) != 0) {
    perror(argv[1]);
    return 1;
  }
  if (status != MODEL_DONE)
    fputs(status == MODEL_STEP_TOO_SMALL ? "the step became too small\n"
         : status == MODEL_OUT_OF_RANGE  ? "an input is beyond its range\n"
@failures@                                         : "a state or an output is not finite, or below its limit\n", stderr);
  return status;
}
