// Body of a native function of solver.py: types and functions for all segments at once; a vector has a lane per segment.
// solver.py defines the constants in capitals.
typedef double lanes __attribute__((vector_size(8 * LANES), aligned(8), may_alias));
struct column {
    enum { width = 1 };
    lanes m[SIZE];
};
struct submatrix {
    enum { width = SIZE };
    lanes m[SIZE * SIZE];
    lanes& operator()(int i, int j) { return m[SIZE * i + j]; }
    const lanes& operator()(int i, int j) const { return m[SIZE * i + j]; }
};
lanes* const first = reinterpret_cast<lanes*>(S.data);
const long next_row = S.shape[1] / LANES;
const auto at_place = [=](int row, int p) { return first + next_row * row + p; };
const auto at_separators = [=](int number) { return at_place(SEPARATORS, number); };
const auto load = [](auto& to, const lanes* from, long stride) {
    for (auto& number : to.m) {
        number = *from;
        from += stride;
    }
};
const auto store = [](const auto& from, lanes* to, long stride) {
    for (const auto& number : from.m) {
        *to = number;
        to += stride;
    }
};
// to += sign a b; the sign is known when this is compiled
const auto add = [](auto& to, const submatrix& a, const auto& b, double sign) {
    const int width = b.width;
    for (int i = 0; i < SIZE; i++)
        for (int j = 0; j < width; j++)
            for (int k = 0; k < SIZE; k++)
                to.m[width * i + j] += sign * a(i, k) * b.m[width * k + j];
};
// to += sign a b for the a that is stored from this number on
const auto add_stored = [=](auto& to, const lanes* stored, long stride, const auto& b, double sign) {
    submatrix a;
    load(a, stored, stride);
    add(to, a, b, sign);
};
const auto invert = [](const auto& m) {
    submatrix to;
    if constexpr (SIZE == 2) {
        const lanes scale = 1.0 / (m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0));
        to(0, 0) = m(1, 1) * scale;
        to(0, 1) = -m(0, 1) * scale;
        to(1, 0) = -m(1, 0) * scale;
        to(1, 1) = m(0, 0) * scale;
    } else {
        const lanes a = m(1, 1) * m(2, 2) - m(1, 2) * m(2, 1);
        const lanes b = m(1, 2) * m(2, 0) - m(1, 0) * m(2, 2);
        const lanes c = m(1, 0) * m(2, 1) - m(1, 1) * m(2, 0);
        const lanes scale = 1.0 / (m(0, 0) * a + m(0, 1) * b + m(0, 2) * c);
        to(0, 0) = a * scale;
        to(0, 1) = (m(0, 2) * m(2, 1) - m(0, 1) * m(2, 2)) * scale;
        to(0, 2) = (m(0, 1) * m(1, 2) - m(0, 2) * m(1, 1)) * scale;
        to(1, 0) = b * scale;
        to(1, 1) = (m(0, 0) * m(2, 2) - m(0, 2) * m(2, 0)) * scale;
        to(1, 2) = (m(0, 2) * m(1, 0) - m(0, 0) * m(1, 2)) * scale;
        to(2, 0) = c * scale;
        to(2, 1) = (m(0, 1) * m(2, 0) - m(0, 0) * m(2, 1)) * scale;
        to(2, 2) = (m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0)) * scale;
    }
    return to;
};
const auto multiple_of_one = [](lanes value) {
    submatrix to = {};
    for (int i = 0; i < SIZE; i++) to(i, i) = value;
    return to;
};
// lane s is lane s + by of the other one; that, too, is known when this is compiled
const auto turned = [](const auto& from, int by) {
    auto to = from;
    for (int k = 0; k < SIZE * from.width; k++)
        for (int s = 0; s < LANES; s++) to.m[k][s] = from.m[k][(s + by) % LANES];
    return to;
};
// places that repeat a separator
lanes begins = {};
for (int s = full; s < LANES; s++) begins[s] = 1.0;
const auto where_repeated = [=](lanes value, lanes other) { return begins != 0.0 ? value : other; };
