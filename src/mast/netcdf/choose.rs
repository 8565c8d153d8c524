//! Variables of a mast's file by their standard names, else by usual ones.

use crate::base::netcdf::{NetcdfFile, Variable, is_number, listed, text};
use crate::base::plain::plain;
use crate::mast::mapping::{EAST, NORTH, UP, UP_SD, UP_VARIANCE};

/// A quantity that is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Up,
    East,
    North,
    Variance,
    Deviation,
}

impl Quantity {
    /// Name of its table in a mapping.
    pub(super) fn key(self) -> &'static str {
        match self {
            Self::Up => "w",
            Self::East => "u",
            Self::North => "v",
            Self::Variance => "w_variance",
            Self::Deviation => "w_sd",
        }
    }

    fn standard_name(self) -> &'static str {
        match self {
            Self::Up | Self::Variance | Self::Deviation => "upward_air_velocity",
            Self::East => "eastward_wind",
            Self::North => "northward_wind",
        }
    }

    /// Names by which it is known where no variable has its standard name.
    fn usual(self) -> &'static [&'static str] {
        match self {
            Self::Up => &UP,
            Self::East => &EAST,
            Self::North => &NORTH,
            Self::Variance => &UP_VARIANCE,
            Self::Deviation => &UP_SD,
        }
    }

    /// Whether a variable with the standard name is this quantity, by its `cell_methods`.
    fn fits(self, variable: &Variable) -> bool {
        let methods = text(variable, "cell_methods").unwrap_or_default();
        let has = |word: &str| methods.contains(word);
        match self {
            Self::Variance => has("variance"),
            Self::Deviation => has("standard_deviation"),
            _ => !["variance", "standard_deviation", "maximum", "minimum", "range"]
                .iter()
                .any(|word| has(word)),
        }
    }
}

/// The variable that holds a quantity; `None`: there is none.
///
/// # Errors
/// If several could be meant, with their names.
pub(super) fn find(file: &NetcdfFile, quantity: Quantity) -> Result<Option<&Variable>, String> {
    let called = |variable: &Variable, name: &str| variable.name().eq_ignore_ascii_case(name);
    let numbers = || file.variables().iter().filter(|one| is_number(one) && one.ndim() > 0);
    let standard: Vec<&Variable> = numbers()
        .filter(|one| text(one, "standard_name").as_deref() == Some(quantity.standard_name()))
        .filter(|one| quantity.fits(one))
        .collect();
    if let [only] = standard[..] {
        return Ok(Some(only));
    }
    // A variable that says that it is something else is not known by its name.
    let free = |one: &&Variable| {
        let own = text(one, "standard_name");
        own.is_none_or(|own| own == quantity.standard_name() && quantity.fits(one))
    };
    let usual = quantity.usual().iter().find_map(|name| {
        if standard.is_empty() {
            numbers().filter(free).find(|one| called(one, name))
        } else {
            standard.iter().copied().find(|one| called(one, name))
        }
    });
    if usual.is_none() && !standard.is_empty() {
        let names: Vec<String> =
            standard.iter().take(20).map(|one| plain(one.name()).into_owned()).collect();
        return Err(format!(
            "several variables are {} ({}): name one of them under [{}] in a TOML file (docs/mast.md) and give that",
            quantity.standard_name(),
            listed(&names),
            quantity.key()
        ));
    }
    Ok(usual)
}
