/* Replay of a recorded run. The expected commands are those of the printed operations in IEEE 754 double precision;
   they are met bit by bit if products and sums are not fused (gcc, clang: -ffp-contract=off, which -std=c99 implies for
   gcc). */