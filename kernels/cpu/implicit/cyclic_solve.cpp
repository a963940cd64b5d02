// Body of a native function of solver.py, `solve`, behind segment_vectors.cpp.
column value = {}, own = {}, next;
for (int p = 1; p < places; p++) {
    load(next, at_place(RIGHT, p), next_row);
    if (p == 1)
        for (auto& number : next.m) number = where_repeated(lanes{}, number);
    add_stored(next, at_place(LOWER, p), next_row, value, -1.0);
    value = column{};
    add_stored(value, at_place(DIAGONAL, p), next_row, next, 1.0);
    add_stored(own, at_place(HEAD, p), next_row, value, 1.0);
    store(value, at_place(RIGHT, p), next_row);
}
load(next, at_place(RIGHT, places), next_row);
add_stored(next, at_place(LOWER, places), next_row, value, -1.0);
value = next;
add_stored(value, at_separators(COUPLING), 1, turned(own, 1), -1.0);
#pragma unroll
for (int r = 0; r < ROUNDS; r++) {
    const column from_before = turned(value, LANES - (1 << r)), from_after = turned(value, 1 << r);
    add_stored(value, at_separators(ROUND_PARTS + 2 * SQUARE * r), 1, from_before, -1.0);
    add_stored(value, at_separators(ROUND_PARTS + SQUARE + 2 * SQUARE * r), 1, from_after, -1.0);
}
next = column{};
add_stored(next, at_separators(LAST_PIVOT), 1, value, 1.0);
store(next, at_place(RIGHT, places), next_row);
const column before = turned(next, LANES - 1);
for (int p = places - 1; p > 0; p--) {
    load(value, at_place(RIGHT, p), next_row);
    add_stored(value, at_place(FILL, p), next_row, before, 1.0);
    add_stored(value, at_place(UPPER, p), next_row, next, -1.0);
    store(value, at_place(RIGHT, p), next_row);
    next = value;
}
