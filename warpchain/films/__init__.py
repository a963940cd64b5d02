"""Films of walks: the friction of a floor, and the parameters of a chain with errors that hold.

from warpchain import films
film = films.read("film.csv", links=60, frequency=20.0)
print(films.friction_line(film))
bank = films.Bank.of(warpchain.sweep("bank.yaml", "bank"))
print(bank.posterior([film]))
"""

from warpchain.films.bank import Bank as Bank
from warpchain.films.bank import Posterior as Posterior
from warpchain.films.film import Camera as Camera
from warpchain.films.film import Film as Film
from warpchain.films.film import film_of as film_of
from warpchain.films.sliding import FrictionLine as FrictionLine
from warpchain.films.sliding import friction_line as friction_line
from warpchain.films.text_table import read as read
