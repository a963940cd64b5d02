// Body of a native function of solver.py, `factor`, behind segment_vectors.cpp.
//
// Row p becomes x_p = y_p − U x_{p+1} + fill e, y_p = D (r_p − L y_{p−1}), with new D, U and fill; e is the separator
// before the segment. The first unknown that the segment owns is Σ head y + sum e plus the segment's separator times the
// head that is left over.
for (int k = 0; k < SQUARE; k++) {
    const double one = k % (SIZE + 1) == 0;
    lanes &low = *at_place(LOWER + k, 1), &centre = *at_place(DIAGONAL + k, 1);
    lanes& up = *at_place(UPPER + k, 1);
    low = where_repeated(lanes{} - one, low);
    centre = where_repeated(lanes{} + one, centre);
    up = where_repeated(lanes{}, up);
}
submatrix ahead = {}, sum = {}, across = multiple_of_one(lanes{} + 1.0);
submatrix head = multiple_of_one(lanes{} + 1.0 - begins), low, up;
for (int p = 1; p < places; p++) {
    submatrix pivot, product = {};
    load(low, at_place(LOWER, p), next_row);
    load(up, at_place(UPPER, p), next_row);
    load(pivot, at_place(DIAGONAL, p), next_row);
    add(pivot, low, ahead, -1.0);
    pivot = invert(pivot);
    add(product, low, across, 1.0);
    ahead = submatrix{};
    across = submatrix{};
    add(ahead, pivot, up, 1.0);
    add(across, pivot, product, -1.0);
    add(sum, head, across, 1.0);
    store(pivot, at_place(DIAGONAL, p), next_row);
    store(ahead, at_place(UPPER, p), next_row);
    store(across, at_place(FILL, p), next_row);
    store(head, at_place(HEAD, p), next_row);
    submatrix left_over = multiple_of_one(p == 1 ? begins : lanes{});
    add(left_over, head, ahead, -1.0);
    head = left_over;
}
submatrix below = {}, centre, above = {};
load(low, at_place(LOWER, places), next_row);
load(up, at_place(UPPER, places), next_row);
load(centre, at_place(DIAGONAL, places), next_row);
add(below, low, across, 1.0);
add(centre, low, ahead, -1.0);
add(centre, up, turned(sum, 1), 1.0);
add(above, up, turned(head, 1), 1.0);
store(up, at_separators(COUPLING), 1);
#pragma unroll
for (int r = 0; r < ROUNDS; r++) {
    const int after = 1 << r, before = LANES - after;
    const submatrix pivot = invert(centre);
    submatrix from_before = {}, from_after = {}, next_below = {}, next_above = {};
    add(from_before, below, turned(pivot, before), 1.0);
    add(from_after, above, turned(pivot, after), 1.0);
    store(from_before, at_separators(ROUND_PARTS + 2 * SQUARE * r), 1);
    store(from_after, at_separators(ROUND_PARTS + SQUARE + 2 * SQUARE * r), 1);
    add(centre, from_before, turned(above, before), -1.0);
    add(centre, from_after, turned(below, after), -1.0);
    add(next_below, from_before, turned(below, before), -1.0);
    add(next_above, from_after, turned(above, after), -1.0);
    below = next_below;
    above = next_above;
}
for (int k = 0; k < SQUARE; k++) centre.m[k] += below.m[k] + above.m[k];
store(invert(centre), at_separators(LAST_PIVOT), 1);
