/// Cases of the forward model: row, deformed by the rule or at rest, column, and Ω rounded to f64.
const CASES: [(usize, bool, usize, f64); 6] = [
    (0, false, 0, 69.732_600_274_078_82),
    (3, false, 8, 46.737_473_715_473_56),
    (7, false, 17, 69.732_600_274_078_82),
    (0, true, 0, 69.828_092_558_371_75),
    (4, true, 9, 45.423_202_802_756_414),
    (7, true, 16, 65.631_196_488_568_1),
];
