//! Parameters that several models share, word for word, and what reads them.

mod interfaces;
mod lobes;
mod principled;

pub(super) use interfaces::*;
pub(super) use lobes::*;
pub(super) use principled::*;

use crate::parameter::{Interval, Kind, Levels, Parameter, Range, Role, Scale};

const UNIT: Interval = Interval::closed(0.0, 1.0);

/// A number from 0 to 1.
pub(in crate::models) const fn unit_number(
    (name, symbol, role): (&'static str, &'static str, Role),
    default: f64,
    summary: &'static str,
) -> Parameter {
    Parameter {
        name,
        symbol,
        role,
        unit: "1",
        summary,
        kind: Kind::Number {
            range: Range {
                valid: UNIT,
                plausible: UNIT,
                scale: Scale::Linear,
                search: Levels::new(0.0, 1.0, 0.05),
                survey: Levels::new(0.05, 1.0, 0.05),
            },
            default,
        },
    }
}

/// A colour, each channel from 0 to 1.
pub(in crate::models) const fn unit_colour(
    (name, symbol, role): (&'static str, &'static str, Role),
    default: [f64; 3],
    summary: &'static str,
) -> Parameter {
    Parameter {
        name,
        symbol,
        role,
        unit: "1",
        summary,
        kind: Kind::Colour {
            range: Range {
                valid: UNIT,
                plausible: UNIT,
                scale: Scale::Linear,
                search: Levels::new(0.0, 1.0, 0.05),
                survey: Levels::new(0.1, 1.0, 0.1),
            },
            default,
        },
    }
}
